"""Sensor streams to one pose per machine, with covariance, age and validity."""
