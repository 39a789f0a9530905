"""One problem fitted to many recordings of many machines, and what of it changed over time."""
