"""Passes questions of descry on to the running body, a JSON line each way."""

import socket
import sys

with socket.socket(socket.AF_UNIX) as connection:
    connection.connect("world.sock")
    with connection.makefile("rw") as body:
        for line in sys.stdin:
            body.write(line)
            body.flush()
            print(body.readline(), end="", flush=True)
