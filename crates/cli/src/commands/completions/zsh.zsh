
_standstill_settings() {
    local settings=(
§settings§    )
    _describe -t settings setting settings -S ''
}
_standstill_keys() {
    local keys=(
§keys§    )
    _describe -t keys key keys
}
_standstill_motors() {
    _alternative 'motors:motor:(§motors§)' 'files:scenario or data sheet:_files'
}
