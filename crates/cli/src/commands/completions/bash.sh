
_standstill_settings="§settings§"
_standstill_keys="§keys§"
_standstill_motors="§motors§"
_standstill_or_setting() {
    local IFS=$' \t\n' current="${COMP_WORDS[COMP_CWORD]}" at=$COMP_CWORD key="" option
    if [[ $current == "=" ]]; then current=""; at=$((at + 1)); fi
    if [[ ${COMP_WORDS[at - 1]} == "=" ]]; then key="${COMP_WORDS[at - 2]}="; at=$((at - 2)); fi
    option="${COMP_WORDS[at - 1]}"
    if [[ $option == "=" ]]; then option="${COMP_WORDS[at - 2]}"; elif [[ $key == --set= ]]; then option=--set; key=""; fi
    if [[ $option == --key ]]; then
        COMPREPLY=($(compgen -W "$_standstill_keys" -- "$current"))
        return 0
    fi
    if [[ $option == --motor ]]; then
        COMPREPLY=($(compgen -W "$_standstill_motors" -- "$current"))
        return 0
    fi
    if [[ $option == -s || $option == --set || $option == --vary ]]; then
        COMPREPLY=($(compgen -W "$_standstill_settings" -- "$key$current"))
        COMPREPLY=("${COMPREPLY[@]#"$key"}")
        [[ ${#COMPREPLY[@]} -eq 1 && ${COMPREPLY[0]} == *= ]] && type compopt >/dev/null 2>&1 && compopt -o nospace
        return 0
    fi
    _standstill "$@"
    case " §commands§ " in
        *" ${COMP_WORDS[1]} "*)
            if [[ $current != -* && $COMP_CWORD -eq 2 ]]; then
                COMPREPLY=($(compgen -W "$_standstill_motors" -- "$current"))
            fi ;;
    esac
}
complete -F _standstill_or_setting -o bashdefault -o default standstill
