"""Cameras of the machines: pictures fetched once for all who watch, with an honest age."""
