"""The JSON documents that people script against: read, written and described by a schema."""
