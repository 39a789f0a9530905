"""Fitted drives in the formats of other programs, what those cannot express, and what that costs."""
