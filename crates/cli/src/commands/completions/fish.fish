function __standstill_settings
§settings§end
function __standstill_keys
§keys§end
