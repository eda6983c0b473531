"""The verification suite: ``suite.yaml`` says what is run, one module a kind of experiment how.

What the experiments must show is the business of ``dragchain.verification``,
which sees the run folders alone.
"""
