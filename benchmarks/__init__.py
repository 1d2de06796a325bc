"""Speed against other renderers, as ratios measured in one session; started by `./build.sh bench`."""
