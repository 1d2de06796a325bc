"""Attacks on the program: `./build.sh reliability NAME`. Each tells its number of tries and its findings."""
