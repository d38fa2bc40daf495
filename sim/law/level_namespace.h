#pragma once

/// Formulas and loops that stand in headers are compiled for several instruction sets within one program.
/// Each has an inline namespace of its own, so that no two share a symbol. Of those that do the linker keeps
/// any one, and that one may not run on the machine at hand.
#ifndef FLASH_LEVEL
#define FLASH_LEVEL baseline
#endif
