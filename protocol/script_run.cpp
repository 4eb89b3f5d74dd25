#include "protocol/script.hpp"
