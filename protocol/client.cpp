#include "protocol/client.hpp"
