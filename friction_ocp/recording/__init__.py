"""Recordings of a machine: reading, checking, importing and conditioning them."""
