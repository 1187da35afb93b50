/* What the interfaces of FMI 2.0 and 3.0 have in common: an instance with its variables by reference.

   References count the numbers that can be set first, then the outputs. */

#ifndef GEARMBS_FMU_H
#define GEARMBS_FMU_H

#include "gearmbs.h"

enum { FMU_OK, FMU_WARNING, FMU_DISCARD, FMU_ERROR, FMU_FATAL };

typedef struct fmu {
    gearmbs_instance *instance;
    double *outputs;
    int known;  /* whether outputs hold what they are at the present time */
    void *environment, *logger, *update;
    int returns_early; /* whether a step may end before its time */
    char *name;
    void (*tell)(const struct fmu *self, int status, const char *message);
} fmu;

fmu *fmu_new(const char *name, const char *token, void *environment, void *logger,
             void (*tell)(const fmu *, int, const char *));
void fmu_free(fmu *self);
int fmu_get(fmu *self, const unsigned *references, size_t count, double *values);
int fmu_set(fmu *self, const unsigned *references, size_t count, const double *values);
int fmu_derivative(fmu *self, const unsigned *unknowns, size_t rows, const unsigned *known, size_t columns,
                   const double *along, double *values);
int fmu_span(const fmu *self, double start, int has_stop, double stop);
int fmu_end(const fmu *self, double time, double size, double *end);
int fmu_go(fmu *self, double end);
int fmu_step(fmu *self, double time, double size);
double fmu_next(const fmu *self);
int fmu_reset(fmu *self);
int fmu_save(fmu *self, void **state);
int fmu_restore(fmu *self, const void *state, size_t size);
int fmu_refuse(const fmu *self, const char *message);

#endif
