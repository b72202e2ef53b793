"""Many documents in, an output each and a manifest out; what was done before is not done again."""
