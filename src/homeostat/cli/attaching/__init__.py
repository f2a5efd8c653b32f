"""What 'homeostat attach' reads before it begins, so that a guard that was killed with everything is soon back."""
