"""First drafts of problem files: from a model, a template, or answers, with the recordings of a folder."""
