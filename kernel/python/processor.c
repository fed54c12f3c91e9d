/* Which instruction levels this processor and its operating system support. Built without any of them. */
#define PY_SSIZE_T_CLEAN
#include <Python.h>

static PyObject* levels(PyObject* self, PyObject* unused) {
    (void)self;
    (void)unused;
    PyObject* out = PyList_New(0);
    if (!out) return NULL;
    const char* found[4];
    int n = 0;
#if defined(__x86_64__)
    __builtin_cpu_init();
#define HAS(feature) __builtin_cpu_supports(feature)
    if (HAS("avx512f") && HAS("avx512bw") && HAS("avx512cd") && HAS("avx512dq") && HAS("avx512vl") && HAS("avx2")
        && HAS("fma") && HAS("bmi") && HAS("bmi2"))
        found[n++] = "x86-64-v4";
    if (HAS("avx2") && HAS("fma") && HAS("bmi") && HAS("bmi2")) found[n++] = "x86-64-v3";
    if (HAS("sse4.2") && HAS("ssse3") && HAS("popcnt")) found[n++] = "x86-64-v2";
#endif
    found[n++] = "generic";
    for (int i = 0; i < n; ++i) {
        PyObject* name = PyUnicode_FromString(found[i]);
        if (!name || PyList_Append(out, name) != 0) {
            Py_XDECREF(name);
            Py_DECREF(out);
            return NULL;
        }
        Py_DECREF(name);
    }
    return out;
}

static PyMethodDef methods[] = {{"levels", levels, METH_NOARGS, "The supported levels, fastest first."},
                                {NULL, NULL, 0, NULL}};
static struct PyModuleDef module = {PyModuleDef_HEAD_INIT, "_processor", NULL, -1, methods, NULL, NULL, NULL, NULL};
PyMODINIT_FUNC PyInit__processor(void) { return PyModule_Create(&module); }
