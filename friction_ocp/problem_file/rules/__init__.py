"""The rules that a problem has to obey: one function a rule, each yielding its findings."""
