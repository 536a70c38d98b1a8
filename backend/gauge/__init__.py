"""The virtual working gauge: infrastructure features to limit volumes (Mäkinen 2021)."""
