// Result<T>: the value of a function that can fail, or its error. An installed package has core/base/result.h under this name.
#pragma once

#include "core/base/result.h"
