"""The search for drives that meet one target.

Common arguments: `problem` has the target quantities and limits; `before` is the packed state
before, `start` its drives, `known` its values and slopes if they are known; `goal` is the target,
NaN where an entry is free.
"""
