"""The paper's study: six cases, their levels, their claims."""
