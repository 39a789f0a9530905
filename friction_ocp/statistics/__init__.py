"""What an identification is worth: other starts, profile likelihood, bootstrap, other models."""
