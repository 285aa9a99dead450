"""What does the file of a search for the best grasp hold?"""
