"""The virtual working gauge (Mäkinen 2021): drawings and models to features, these to volumes.

`read` takes a file (LandXML, Inframodel, CSV, mesh, IFC) and returns one `Model`; `rules` makes
limit volumes of features.
"""
