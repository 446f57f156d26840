extern "C" const char* arex_plugin_abi() { return "arex 0, some other compiler"; }
extern "C" void arex_plugin_register(void*) {}
