"""Attacks on the program as commands: `./build.sh reliability NAME`. Each says how often it tried, and what it found."""
