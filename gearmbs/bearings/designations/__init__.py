"""What a designation tells of a bearing: boundary dimensions, ratings, class of clearance, and what is estimated."""
