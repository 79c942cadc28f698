/* The executed lines, where the library counts them (`make coverage`). */

void host_write_coverage(void);
void __gcov_dump(void);

/* Called before the process ends: one that is killed at its end would write nothing. */
void host_write_coverage(void)
{
#ifdef COVERAGE
    __gcov_dump();
#endif
}
