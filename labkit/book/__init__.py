"""The reading edition: every chapter as a page that needs neither Python nor a network; its figures still move.

text        Markdown with formulas and code, as HTML
notebook    what of a solved notebook a book shows
cells       a chapter's solved notebook as HTML: text, code, outputs, predictions that open on a click
figures     the Stages of the course by the names their notebooks call them, recorded
site        the pages together: contents, chapters, ledger with search, all figures
"""
