"""Places and heads to render: the demo café, and heads with pores, hair and lashes.

Scripts render them for the program, benchmarks for reference pictures.
"""
