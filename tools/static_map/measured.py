#!/usr/bin/env python3
"""Runs a command and writes its CPU seconds and its peak memory in MB to a file.

    measured.py FILE COMMAND [ARGUMENT...]
"""
import resource
import subprocess
import sys

status = subprocess.run(sys.argv[2:], stdout=subprocess.DEVNULL).returncode
usage = resource.getrusage(resource.RUSAGE_CHILDREN)
with open(sys.argv[1], "w") as file:
    print(f"{usage.ru_utime + usage.ru_stime:.3f} {usage.ru_maxrss / 1024:.0f}", file=file)
sys.exit(status)
