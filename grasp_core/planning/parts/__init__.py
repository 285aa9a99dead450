"""Parts of a plan that do not depend on one another, and processes that find some of them."""
