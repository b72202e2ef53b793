"""The library of expressions: shipped ones and a user's own, what they mean, and timelines of them."""
