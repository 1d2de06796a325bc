"""Speed against other renderers, as ratios from one session; and memory, time and noise by size. `./build.sh bench` starts both."""
