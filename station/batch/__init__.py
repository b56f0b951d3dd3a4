"""`planish batch`: many scans restored by many processes or machines.

Each page is isolated from the others.

whole       folders and sessions in one run, and its report
folders     scans of folders: plan (what is still to do, longest first), page (the work on one), outcomes (what became)
sessions    pages of sessions
run         the pages handed out one by one, a result for each
executors   threads of this computer or a Dask cluster, which hand pages to processes
process     the process of a page: started, limited, ended, started again; child is its main loop
progress    how far it is, and with estimate the interval in which it ends
report      the HTML report, worst pages first
"""
