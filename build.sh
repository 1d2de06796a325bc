#!/usr/bin/env bash
# The one door to the project: sets up its environment where needed, then does what is asked.
set -euo pipefail
cd -- "$(dirname -- "${BASH_SOURCE[0]}")"
unset PYTHONHOME PYTHONPATH VIRTUAL_ENV UV_PROJECT_ENVIRONMENT PIP_USER PIP_TARGET PIP_PREFIX # of another project, or of the caller's shell
unset PYTHONDONTWRITEBYTECODE # or each process that starts compiles numba, bpy and torch anew, for six seconds
export UV_HTTP_TIMEOUT=300 # torch and bpy are large

UV_VERSION=0.13.9

usage() {
    cat <<'EOF'
./build.sh setup     make .venv: uv, Python 3.13, locked dependencies (the others do this by themselves), and let Blender
                     know where it is; `setup torch numba` installs these anew, should they be broken
./build.sh demo      open scenes/c1.blend, render it by three methods, compare them in out/demo/report.html
./build.sh test      run the tests, three at a time, as some wait for a window; further arguments go to pytest, e.g.
                     -k metrics, or -n 0 for one at a time
./build.sh check     formatter, linter, type checker, import contracts
./build.sh bench     speed against Mitsuba and Cycles, in out/bench/latest.json; `bench size`: memory, time and noise
                     against triangles, emitters and pixels, in out/bench/size.json; `bench window`: how long F12 keeps
                     Blender's window from answering, beside Cycles, in out/bench/window.json
./build.sh reliability NAME [--count N] [--seed S] [--bounds] [--only STEP]
                     attacks on the program, in out/reliability/NAME.json: fuzz (bundles, renders, lines, settings, folders, caches,
                     checkpoints), kills, bits, disk, writers, starts, worker; or all. Ctrl-C ends one, the same command goes on
./build.sh extension make the zip to install in Blender 4.5 or 5.2, out/rl_guided-<version>.zip; a further argument names another folder
EOF
}

fail() {
    echo "build.sh: $*" >&2
    exit 1
}

# Prints the uv to use: the one on PATH, or a private one from PyPI.
find_uv() {
    if command -v uv; then return; fi
    if [[ ! -x .uv/bin/uv ]]; then
        echo "Getting uv $UV_VERSION from PyPI into .uv/ ..." >&2
        rm -rf .uv
        python3 -m venv .uv >&2 || fail "no uv on PATH, and python3 -m venv failed: install Python 3 with venv (Debian: python3-venv), or uv"
        .uv/bin/python -m pip install --quiet --disable-pip-version-check "uv==$UV_VERSION" >&2 || fail "uv $UV_VERSION could not be installed from PyPI"
    fi
    echo .uv/bin/uv
}

# Prints a Python 3.13: on PATH, under pyenv, or a version for uv to download.
find_python() {
    local candidate
    for candidate in python3.13 "${PYENV_ROOT:-$HOME/.pyenv}"/versions/3.13.*/bin/python; do
        # A pyenv shim of that name may exist and still refuse to run.
        if "$candidate" -c 'import sys; sys.exit(sys.version_info[:2] != (3, 13))' 2>/dev/null; then
            "$candidate" -c 'import sys; print(sys.executable)'
            return
        fi
    done
    echo 3.13
}

broken=() # packages that setup installs anew though they seem to be there

# setup [group]: brings .venv up to date, with a further dependency group if named; does nothing if nothing changed.
setup() {
    local stamp=.venv/.stamp uv key
    key="$(cat build.sh pyproject.toml uv.lock | cksum) $PWD ${1:-}"
    if [[ -f $stamp && "$(<"$stamp")" == "$key"* ]]; then return; fi
    uv=$(find_uv)
    "$uv" sync --frozen --python "$(find_python)" ${1:+--group "$1"} "${broken[@]/#/--reinstall-package=}"
    # Writes the bytecode of what a render imports, for those who have forbidden Python to write it later.
    .venv/bin/python -c 'import addon, bpy, numba, torch, blender_rl_guiding.experiments.runner, blender_rl_guiding.guiding.dqn; numba.njit(lambda: 0)()'
    .venv/bin/python -I -m blender_rl_guiding.environment announce || true # it says why Blender will have to be told
    printf '%s' "$key" >"$stamp"
}

command=${1:-help}
shift || true
case $command in
setup)
    rm -f .venv/.stamp # it is asked for when something is missing that was there
    broken=("$@")
    setup
    ;;
demo)
    setup
    .venv/bin/rlg compare scenes/c1.blend --methods uniform,bsdf,dqn --spp 32 --seeds 1 --reference scenes/c1-reference.exr --out out/demo
    ;;
test)
    setup
    .venv/bin/python -m pytest --numprocesses=3 "$@"
    ;;
check)
    setup
    .venv/bin/ruff format --check
    .venv/bin/ruff check
    .venv/bin/pyright
    .venv/bin/lint-imports
    ;;
bench)
    setup bench
    .venv/bin/python -m benchmarks "$@"
    ;;
reliability)
    setup
    .venv/bin/python -m benchmarks.reliability "$@"
    ;;
extension)
    setup
    .venv/bin/python -m scripts.extension "$(find_uv)" "${1:-out}"
    ;;
help | -h | --help)
    usage
    ;;
*)
    usage >&2
    fail "there is no command '$command'"
    ;;
esac
