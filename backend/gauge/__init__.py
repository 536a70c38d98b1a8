"""The working gauge: what drawings and models say about tracks, cables and ground.

`read` takes a file (LandXML, Inframodel, CSV, mesh, IFC) and returns one `Model`.
"""
