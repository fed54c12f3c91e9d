"""The compiled kernel, one module an instruction level; `spacearm.core.native` chooses one."""
