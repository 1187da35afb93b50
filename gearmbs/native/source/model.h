/* What the compiled parts of an exported model are called, and where its structs stand in the memory of an instance. */

#ifndef GEARMBS_MODEL_H
#define GEARMBS_MODEL_H

#include <stdint.h>

typedef struct {
    const char *name, *digest, *token;         /* digest: of the memory, 16 characters; token: of all */
    double t_start, t_end;
    int64_t block, state, size;                /* bytes: of what is given, of a state, of an instance */
    int64_t piece_count;
    const int64_t *pieces;                     /* pairs: beginning and end of what is not zero of what is given */
    int64_t inside_count, function_count;
    const int64_t *inside;                     /* where offsets become addresses */
    const int64_t *functions;                  /* pairs: where functions stand, and which */
    void *const *kernels;
    int64_t late_count;
    const char *const *late_names;
    void *const *late;
    /* offsets of structs */
    int64_t bound, run, part, plan, factors, driver, room, columns, rows;
    int64_t teller, told_plan, told_factors, told_room, told_columns, told_rows;
    /* offsets of single members and arrays */
    int64_t time, present, steps, integrated, waiting, wanted, values, rates, out;
    int64_t counts;                            /* whether outputs count angles from point to point */
    int64_t numbers, outputs, unknowns;
    const int64_t *widths;                     /* of each number and output how many a variable of its reference has */
    const char *const *number_names, *const *number_units;
    const char *const *output_names, *const *output_units;
    const char *const *unknown_names;
} gearmbs_model;

extern const gearmbs_model gearmbs_this;
extern const unsigned char gearmbs_block[];

/* Kernels: they return 0, or another number where something has gone wrong, and write their result first. */
int gearmbs_go_to(int64_t *code, void **error, void *bound, void *run, void *part, void *plan, void *factors,
                  void *driver, double t);
int gearmbs_apply(int64_t *changes, void **error, void *bound, void *run, void *plan, void *factors, void *driver,
                  int64_t shows);
int gearmbs_present_value(double *value, void **error, void *run, void *driver, int64_t number);
int gearmbs_choose_for_run(int64_t *code, void **error, void *run, void *driver, void *room, void *columns,
                           void *rows, void *plan, void *factors);
int gearmbs_tell(int64_t *code, void **error, void *run, void *driver, void *teller, void *plan, void *factors,
                 int64_t first);
int gearmbs_choose_for_outputs(int64_t *code, void **error, void *run, void *driver, void *teller, void *room,
                               void *columns, void *rows, void *plan, void *factors);
int gearmbs_factor_for_outputs(int64_t *code, void **error, void *driver, void *teller, void *plan, void *factors);

#endif
