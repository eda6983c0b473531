"""Speed against accuracy: what each setting costs and what error it brings."""
