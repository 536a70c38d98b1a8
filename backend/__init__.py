"""The cockpit's rooms. Pure rooms first, the shell last; read `backend.pipeline.step` first."""
