#include "protocol/socket_driver.hpp"
