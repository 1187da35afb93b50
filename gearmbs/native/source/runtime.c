/* What compiled kernels call beside each other and libm: memory of arrays, and what only Python could answer.

   An array's memory is counted: its block begins with a record of six words, of which kernels read the data's address
   and change the count. The layout is that of numba's runtime. */

#include "model.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
    size_t references;
    void (*end)(void *data, size_t size, void *with);
    void *with, *data;
    size_t size;
    void *allocator;
} counted;

void *NRT_MemInfo_alloc_aligned(size_t size, unsigned align) {
    size_t room = sizeof(counted) + size + 2 * (size_t)align;
    counted *made = malloc(room);
    if (made == NULL) abort(); /* kernels do not ask whether there was memory */
    uintptr_t first = (uintptr_t)(made + 1);
    memset(made, 0, sizeof *made);
    made->references = 1;
    made->size = size;
    made->data = (void *)(align > 0 ? (first + align - 1) / align * align : first);
    return made;
}

void *NRT_MemInfo_alloc(size_t size) { return NRT_MemInfo_alloc_aligned(size, 0); }

void NRT_MemInfo_call_dtor(void *memory) {
    counted *own = memory;
    if (own->end != NULL) own->end(own->data, own->size, own->with);
    free(own);
}

void *NRT_Allocate(size_t size) {
    void *made = malloc(size > 0 ? size : 1);
    if (made == NULL) abort();
    return made;
}

void NRT_Free(void *memory) { free(memory); }

#if defined(__GLIBC__) && defined(__x86_64__)
/* Of some functions glibc has versions of later years, which differ in how errors are told: with those of the first a
   library runs where glibc is older than where it was linked. */
#define OF_THE_FIRST(name, told, given)                                                                                \
    double gearmbs_##name told;                                                                                        \
    __asm__(".symver gearmbs_" #name ", " #name "@GLIBC_2.2.5");                                                       \
    double name told { return gearmbs_##name given; }
OF_THE_FIRST(hypot, (double x, double y), (x, y))
OF_THE_FIRST(pow, (double x, double y), (x, y))
OF_THE_FIRST(exp, (double x), (x))
OF_THE_FIRST(exp2, (double x), (x))
OF_THE_FIRST(log, (double x), (x))
OF_THE_FIRST(log2, (double x), (x))
#endif

double numba_nextafter(double x, double y) { return nextafter(x, y); }

/* Write the strides of a contiguous array in another shape; return 0 for one that is not contiguous. */
int numba_attempt_nocopy_reshape(intptr_t dimensions, const intptr_t *shape, const intptr_t *strides,
                                 intptr_t new_dimensions, const intptr_t *new_shape, intptr_t *new_strides,
                                 intptr_t item_size, int by_columns) {
    intptr_t stride = item_size;
    if (by_columns) return 0;
    for (intptr_t k = dimensions - 1; k >= 0; k--) {
        if (shape[k] != 1 && strides[k] != stride) return 0;
        stride *= shape[k];
    }
    stride = item_size;
    for (intptr_t k = new_dimensions - 1; k >= 0; k--) {
        new_strides[k] = stride;
        stride *= new_shape[k];
    }
    return 1;
}

/* Return a late kernel by its name and write its address to where the caller looks next time; NULL without one. */
void *gearmbs_find_late_kernel(void **slot, const char *name) {
    for (int64_t k = 0; k < gearmbs_this.late_count; k++)
        if (strcmp(name, gearmbs_this.late_names[k]) == 0) return *slot = gearmbs_this.late[k];
    return NULL;
}

/* Only a function without compiled code, or an exception, asks for these. */
int numba_gil_ensure(void) { return 0; }
void numba_gil_release(void *state) { (void)state; }
void *PyImport_ImportModule(const char *name) { return (void)name, (void *)NULL; }
void *PyObject_GetAttrString(void *object, const char *name) { return (void)object, (void)name, (void *)NULL; }
void *PyObject_CallFunctionObjArgs(void *function, ...) { return (void)function, (void *)NULL; }
void *PyLong_AsVoidPtr(void *number) { return (void)number, (void *)NULL; }
void *PyUnicode_FromKindAndData(int kind, const void *data, intptr_t size) {
    return (void)kind, (void)data, (void)size, (void *)NULL;
}
intptr_t PyObject_Hash(void *object) { return (void)object, -1; }
void *PyTuple_Pack(intptr_t count, ...) { return (void)count, (void *)NULL; }
void PyErr_SetString(void *kind, const char *text) { (void)kind, (void)text; }
void *PyExc_RuntimeError = NULL;
void Py_DecRef(void *object) { (void)object; }
void *numba_unpickle(const char *data, int size, const char *hash) {
    return (void)data, (void)size, (void)hash, (void *)NULL;
}
