"""The source code of a flowsheet's kernel."""
