"""What ``docs/results/guard.md`` is measured with: one module per part, and one that writes the page."""
