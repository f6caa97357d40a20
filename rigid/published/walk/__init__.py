"""The paper, number by number and equation by equation, computed again."""
