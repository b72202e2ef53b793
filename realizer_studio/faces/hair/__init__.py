"""Hair, brows, lashes and beards as cards: strips with pictures of hairs that follow the skin."""
