"""Runs what is to be compared, and keeps what comes out in folders."""
