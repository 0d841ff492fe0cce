"""The package beside others: error against time."""
