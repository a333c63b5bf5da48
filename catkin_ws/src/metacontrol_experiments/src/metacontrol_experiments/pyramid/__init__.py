"""Missions of demonstrator D1, which builds a pyramid: scenarios, course, record, summary and picture. Pure."""
