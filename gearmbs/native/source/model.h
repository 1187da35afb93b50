/* What the compiled parts of an exported model are called, and where its structs stand in the memory of an instance. */

#ifndef GEARMBS_MODEL_H
#define GEARMBS_MODEL_H

#include <stddef.h>
#include <stdint.h>

/* Inputs that prescribe motions, in models that have them. */
enum { MOTION_ORDERS = 2 };

typedef struct {
    int64_t at, size, order;                   /* among the cells; coefficients; how often it is integrated there */
    double factor, offset;
} motion_place;

typedef struct {
    int64_t cells, numbers;
    const int64_t *cell, *is_input, *prescribes, *first;
    const motion_place *places;
    int64_t afresh, rdata, values;             /* offsets */
    int64_t copies;
    const int64_t *copy;                       /* threes: from where to where so many bytes make a state that starts */
    double t_first;                            /* where the simulation has started */
} motion_tables;

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
    const double *least, *most;                /* of each number what it can be set to */
    const char *const *output_names, *const *output_units;
    const char *const *unknown_names;
    const motion_tables *motions;              /* NULL without any */
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
int gearmbs_start_afresh(int64_t *code, void **error, void *bound, void *run, void *part, void *plan, void *factors,
                         void *driver, void *room, void *columns, void *rows, void *afresh, int64_t begun);
int gearmbs_factor_for_outputs(int64_t *code, void **error, void *driver, void *teller, void *plan, void *factors);

/* Write what is to stand in the cells where numbers have been set; return whether that is something else. */
int gearmbs_new_numbers(const motion_tables *tables, double t, const double *rdata, double *values, int64_t *waiting,
                        const double *wanted);

/* Let a number take any value, for derivatives at the ends of its range. */
struct gearmbs_instance;
int gearmbs_put(struct gearmbs_instance *instance, size_t number, double value);

#endif
