"""What does a depth camera see of an object?"""
