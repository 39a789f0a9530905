"""Tasks that run side by side, and whose results outlive an interrupt."""
