"""Judges what a class handed in, across a process border, and shows what the class made of it; finds chapters by name.

submissions   folders and zip files in, notebooks and their chapters out
batch         one file in, one JSON out; many at a time, none twice
judge         one notebook: runs in a worker, is judged here
worker        the process that runs a notebook and holds no answers
sandbox       where that process runs: under bubblewrap, or behind rails
rails         what Python itself refuses there
border        calling functions across the border
wire          plain data and messages
library       which functions of the library are an exercise's answer
points        what a verdict is worth
report        report.csv, problems.csv, and the numbers of a class
page          class.html and feedback pages
"""
