"""How is work spread over processes, in order, with the same results for any number of them?"""
