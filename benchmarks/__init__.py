"""Speed against other renderers, as ratios measured in one session, and sizes; started by `./build.sh bench`."""
