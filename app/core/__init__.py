"""Maths and plain data: no Qt, no sockets, no global state."""
