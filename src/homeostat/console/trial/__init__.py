"""What if: setpoints that a person moves on the page, rolled out and judged on a twin, and never written from there."""
