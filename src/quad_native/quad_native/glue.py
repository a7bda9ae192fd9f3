"""The C text of an extension module: from Python values to a block of eight-byte cells, and back.

A cell holds a double, an integer or a truth value. ``call`` reads its arguments into cells, runs ``entry``, which Numba
compiled, on the block and makes the results of the cells behind them.
"""

from typing import Any

from quad_core.records import field_kinds, leaves
from quad_native.loading import MODULE, classes
from quad_native.signature import Signature

_HEAD = """\
#define PY_SSIZE_T_CLEAN
#include <Python.h>
#include <stdint.h>

typedef union { double d; int64_t i; } Cell;
/* Numba's calling convention: a result and an error that this function has not, then its argument. */
extern int entry(void *result, void **error, Cell *block);
static PyTypeObject *classes[COUNT + 1];
static Cell block[CELLS + 1];

static int read_float(PyObject *value, Cell *cell) {
    cell->d = PyFloat_CheckExact(value) ? PyFloat_AS_DOUBLE(value) : PyFloat_AsDouble(value);
    return cell->d == -1.0 && PyErr_Occurred() ? -1 : 0;
}
static int read_int(PyObject *value, Cell *cell) {
    cell->i = PyLong_AsLongLong(value);
    return cell->i == -1 && PyErr_Occurred() ? -1 : 0;
}
static int read_bool(PyObject *value, Cell *cell) {
    int truth = PyObject_IsTrue(value);
    cell->i = truth;
    return truth < 0 ? -1 : 0;
}
static PyObject *make_float(const Cell *cell) { return PyFloat_FromDouble(cell->d); }
static PyObject *make_int(const Cell *cell) { return PyLong_FromLongLong(cell->i); }
static PyObject *make_bool(const Cell *cell) { return PyBool_FromLong(cell->i != 0); }
static int is_tuple(PyObject *value, Py_ssize_t size, const char *name) {
    if (PyTuple_Check(value) && PyTuple_GET_SIZE(value) == size) return 1;
    PyErr_Format(PyExc_TypeError, "found %.200s, expected %s", Py_TYPE(value)->tp_name, name);
    return 0;
}
"""

_TAIL = """\
static PyObject *bind(PyObject *self, PyObject *given) {
    if (!is_tuple(given, COUNT, "the classes")) return NULL;
    for (Py_ssize_t k = 0; k < COUNT; k++) {
        PyObject *kind = PyTuple_GET_ITEM(given, k);
        if (!PyType_Check(kind) || !PyType_IsSubtype((PyTypeObject *)kind, &PyTuple_Type)) {
            PyErr_SetString(PyExc_TypeError, "expected NamedTuple classes");
            return NULL;
        }
        Py_INCREF(kind);
        Py_XSETREF(classes[k], (PyTypeObject *)kind);
    }
    Py_RETURN_NONE;
}
static PyMethodDef methods[] = {
    {"bind", bind, METH_O, "Set the classes of the results."},
    {"call", (PyCFunction)(void (*)(void))call, METH_FASTCALL, "Call the function."},
    {NULL, NULL, 0, NULL}};
static PyModuleDef_Slot slots[] = {{0, NULL}};
static struct PyModuleDef module = {PyModuleDef_HEAD_INIT, "MODULE", NULL, 0, methods, slots, NULL, NULL, NULL};
PyMODINIT_FUNC PyInit_MODULE(void) { return PyModuleDef_Init(&module); }
"""


def glue_text(signature: Signature) -> str:
    """Return the C text for a function of ``signature``."""
    known = classes(signature)
    parts = [_HEAD]
    for number, kind in enumerate(known):
        parts += [_reader(number, kind, known), _maker(number, kind, known)]
    parts += [_call(signature, known), _TAIL]
    text = "".join(parts)
    return text.replace("COUNT", str(len(known))).replace("CELLS", str(signature.cells)).replace("MODULE", MODULE)


def _name(kind: type[Any], known: list[type[Any]]) -> str:
    return str(known.index(kind)) if kind in known else kind.__name__


def _reader(number: int, kind: type[Any], known: list[type[Any]]) -> str:
    lines = [f"static int read_{number}(PyObject *value, Cell *cell) {{"]
    lines.append(f'    if (!is_tuple(value, {len(kind._fields)}, "{kind.__name__}")) return -1;')
    at = 0
    for place, inner in enumerate(field_kinds(kind).values()):
        lines.append(f"    if (read_{_name(inner, known)}(PyTuple_GET_ITEM(value, {place}), cell + {at})) return -1;")
        at += len(leaves(inner))
    return "\n".join([*lines, "    return 0;", "}\n"])


def _maker(number: int, kind: type[Any], known: list[type[Any]]) -> str:
    size = len(kind._fields)
    lines = [f"static PyObject *make_{number}(const Cell *cell) {{"]
    lines.append(f"    PyObject *value = classes[{number}]->tp_alloc(classes[{number}], {size}), *part;")
    lines.append("    if (value == NULL) return NULL;")
    at = 0
    for place, inner in enumerate(field_kinds(kind).values()):
        lines.append(f"    if ((part = make_{_name(inner, known)}(cell + {at})) == NULL) goto failed;")
        lines.append(f"    PyTuple_SET_ITEM(value, {place}, part);")
        at += len(leaves(inner))
    return "\n".join([*lines, "    return value;", "failed:", "    Py_DECREF(value);", "    return NULL;", "}\n"])


def _call(signature: Signature, known: list[type[Any]]) -> str:
    count = len(signature.takes)
    lines = ["static PyObject *call(PyObject *self, PyObject *const *given, Py_ssize_t count) {"]
    lines.append("    void *nothing[2] = {NULL, NULL};")
    lines.append(f"    if (count != {count}) {{")
    lines.append(f'        PyErr_Format(PyExc_TypeError, "found %zd arguments, expected {count}", count);')
    lines.append("        return NULL;")
    lines.append("    }")
    at = 0
    for place, kind in enumerate(signature.takes):
        lines.append(f"    if (read_{_name(kind, known)}(given[{place}], block + {at})) return NULL;")
        at += len(leaves(kind))
    lines.append("    if (entry(nothing, nothing + 1, block)) {")
    lines.append('        PyErr_SetString(PyExc_RuntimeError, "the machine code failed");')
    lines.append("        return NULL;")
    lines.append("    }")
    if signature.single:
        lines.append(f"    return make_{_name(signature.gives[0], known)}(block + {at});")
        return "\n".join([*lines, "}\n"])
    lines.append(f"    PyObject *results = PyTuple_New({len(signature.gives)}), *part;")
    lines.append("    if (results == NULL) return NULL;")
    for place, kind in enumerate(signature.gives):
        lines.append(f"    if ((part = make_{_name(kind, known)}(block + {at})) == NULL) goto failed;")
        lines.append(f"    PyTuple_SET_ITEM(results, {place}, part);")
        at += len(leaves(kind))
    return "\n".join([*lines, "    return results;", "failed:", "    Py_DECREF(results);", "    return NULL;", "}\n"])
