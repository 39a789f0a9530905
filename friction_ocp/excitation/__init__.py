"""What to record next: motions within limits, and what each would tell about parameters and rivals."""
