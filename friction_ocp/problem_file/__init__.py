"""problem_file."""
