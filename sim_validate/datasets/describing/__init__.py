"""How does a dataset describe itself to its readers?

Modules here write the README.md of a finished dataset, the page that also describes it on the
Hugging Face Hub, a website for datasets.
"""
