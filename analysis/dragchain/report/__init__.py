"""The report on a study: findings, figures and the page."""
