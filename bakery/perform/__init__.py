"""A performer drives a portrait: the fits of his clip, and the videos that come of them (Olszewski 2017)."""
