"""The verbs of the public API: each takes what a person has at hand, and calls the packages.

`import drake_quad as dq` gives them as `dq.plan`, `dq.certify` and so on; verbs that need no such
help (`load_robot`, `simulate`) are the packages' own.
"""
